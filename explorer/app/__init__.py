"""The page of the mechanism; state and session know no browser, and all else draws in viser."""
