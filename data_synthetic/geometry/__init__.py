"""Directions, curves and voxel grids: what every room of the package measures with."""
