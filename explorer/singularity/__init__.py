"""Jacobian, strata, distances from singular poses, and motions that change one margin."""
