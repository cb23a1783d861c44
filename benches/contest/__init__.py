"""A contest between divespot and other programs, each in a process of its own."""
