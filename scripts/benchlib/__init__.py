"""What the bench scripts share. Standard library only, but for plots.py."""
