"""The precision of the tool: errors, compliance, deflection, and the budget of tolerances."""
