"""One case through the stages, many cases, and what is written of them."""
