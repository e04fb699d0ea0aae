"""``python -m bvbedit``: the command line, where its script is not on the path."""

from bvbedit.cli import main

if __name__ == "__main__":
    main()
