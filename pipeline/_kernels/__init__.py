"""Compiled kernels of segment and trace: arrays and scalars in, arrays out.

Arrays are C-contiguous, whatever their axes mean.
"""
