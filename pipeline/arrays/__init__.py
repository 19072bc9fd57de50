"""What several stages share: arrays in memory order, sparse boxes, derivatives of sampled grey, splines, polylines."""
