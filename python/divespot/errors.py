"""What divespot raises."""


class DivespotError(Exception):
    """Bad input: one sentence that says what was given and what is needed."""
