"""The stress table of seeing: scenes by a renderer of its own, and what becomes of the wire in each."""
