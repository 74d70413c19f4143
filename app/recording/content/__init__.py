"""What a recording's file holds, piece by piece, and how each is stored."""
