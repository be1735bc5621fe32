"""``python -m sacbus``: the same as the script ``sacbus``."""

from sacbus.cli import main

if __name__ == "__main__":
    main()
