"""Malformed inputs by the thousand (make fuzz): nothing may crash, hang, die or be believed."""
