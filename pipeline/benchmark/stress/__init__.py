"""The stress study: seeded random scenes, each run in a process of its own, each outcome judged independently."""
