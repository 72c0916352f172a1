"""Tables on six legs, as numbers beside the designs: their files, poses, workspace and measures."""
