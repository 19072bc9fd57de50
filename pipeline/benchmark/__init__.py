"""Run time against error, rivals on the same work, and a stress study: what ``wireval bench`` measures."""
