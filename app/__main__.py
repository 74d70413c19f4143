"""``python -m app`` is the command ``dearig``."""

from app.cli import main

if __name__ == "__main__":
    main()
