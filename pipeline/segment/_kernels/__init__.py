"""Compiled kernels of segment: arrays and scalars in, arrays out. Arrays are C-contiguous, whatever their axes mean."""
