"""The claims of the paper, each measured again and judged."""
