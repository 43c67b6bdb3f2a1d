"""Contacts without a bond: their search, their forces, and bonds that become contacts."""
