"""The machine around the mechanism: tool, payload, gravity, actuators, struts and tolerances."""
