"""What the user says: the manifest, the settings, and what is inferred or found wrong before anything runs."""
