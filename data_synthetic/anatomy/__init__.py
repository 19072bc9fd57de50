"""Vessels: drawn, as published, read from files or found in a real scan, each as a signed distance."""
