"""Downloads, pictures, reports and records."""
