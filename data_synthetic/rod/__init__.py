"""The true wire: a stretchable Kirchhoff rod pushed against the anatomy. No code of the judged simulator."""
