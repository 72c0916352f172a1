"""What a machine must do: the requirement, machines that keep it, and its checklist."""
