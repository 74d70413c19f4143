"""Files that real programs write, made by the programs themselves and imported."""
