"""Drawings as SVG, which the report and the page show."""
