"""Own input instead of segment or trace: surfaces, centrelines and curves from the files of other programs."""
