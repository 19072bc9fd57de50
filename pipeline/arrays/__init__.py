"""What several stages share: grids, kernels on a lattice, derivatives of sampled grey, crests, polylines."""
