"""What the explorer adds to viser's page, and the browser that takes pictures of it."""
