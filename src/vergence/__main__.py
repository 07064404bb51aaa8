"""`python -m vergence`: the command line, where its script is not on the path."""

from vergence.app.main import main

main()
