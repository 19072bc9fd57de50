"""Studies of segment and trace: each module prints one table; tests/bench/bench_imaging.py runs them all."""
