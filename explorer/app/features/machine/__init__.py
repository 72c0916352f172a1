"""The machine around the mechanism: tool, payload, gravity, and limits of the parts."""
