"""No test of this folder looks at a figure."""

from tests.unseen import unseen_figures as unseen_figures
