"""The command ``dearig`` with the diagnosis by regression, race and evidence.

    python -m tests.blind.by_evidence diagnose TRAIN.h5 --validate VAL.h5 --json OUT.json

For ``python -m tests.blind --engine evidence``, which compares it with the present search.
"""

from __future__ import annotations


def main() -> None:
    """Run the command ``dearig``."""
    from dearig.analysis import diagnose
    from dearig.cli import main as command
    from dearig.model.diagnosis.by_evidence import diagnose_by_evidence

    diagnose.diagnose = diagnose_by_evidence
    command.main()


if __name__ == "__main__":
    main()
