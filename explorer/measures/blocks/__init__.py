"""Answers in words and numbers, one module for each topic."""
