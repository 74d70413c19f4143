"""Many unattended runs, one after the other, and many fits."""
