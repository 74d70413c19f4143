"""``python -m dearig`` is the command ``dearig``."""

import sys

if __name__ == "__main__":
    # python -m puts the working folder first: a file numbers.py or queue.py in it would take the
    # place of the standard library's
    if not sys.flags.safe_path:
        del sys.path[0]

    from dearig.cli.main import main

    main()
