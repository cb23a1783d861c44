"""``python -m divespot``."""

from divespot.cli import main

if __name__ == "__main__":
    main()
