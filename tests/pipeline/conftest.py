"""No test of this folder looks at a figure."""

from tests.unfitted import unfitted_figures as unfitted_figures
