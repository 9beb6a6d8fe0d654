"""Tasks on the cores of this computer: a runner whose workers are processes of this Python, without other packages."""
