"""Other simulators on the same two scenes: each in one file of ``rivals``, each in its own process, each optional."""
