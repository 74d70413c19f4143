"""Many runs, one after the other without a person beside them, and many fits."""
