"""``python -m dearig`` is the command ``dearig``."""

from dearig.cli.main import main

if __name__ == "__main__":
    main()
