"""Work in processes of their own, and what the window shows of it."""
