"""Synthetic studies with a truth that no part of the judged code has touched."""
