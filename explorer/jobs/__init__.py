"""Long work in processes of its own, with progress, that can be cancelled and outlasts deaths."""
