"""The load on the platform, the reactions to it, and the precision of the tool."""
