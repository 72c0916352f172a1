"""Up to three pinned designs beside the live one: buttons that pin them, measures, drawing."""
