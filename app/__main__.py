"""The command ``dearig``, also as ``python -m dearig``."""

import sys

__all__ = ["main"]


def main() -> None:
    """Run the command. Ctrl-C ends it with one sentence also while the program is loaded."""
    from dearig.acquisition.interrupts import interrupted, note_interrupts

    note_interrupts()
    try:
        from dearig.cli.main import main as run

        run()
    except BaseException as error:
        # a library whose import was interrupted may say so by an error of its own
        if not interrupted() or isinstance(error, SystemExit):
            raise
        if sys.stderr is not None:
            sys.stderr.write("dearig: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    # python -m puts the working folder first: a file numbers.py or queue.py in it would take the
    # place of the standard library's
    if not sys.flags.safe_path:
        del sys.path[0]
    main()
