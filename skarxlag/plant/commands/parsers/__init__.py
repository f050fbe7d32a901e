"""Arguments of the commands, one module for each, without the libraries that they compute with.

The docstring of a module is the description of its command. ``add_arguments(parser)``
declares the arguments. ``check(args)`` raises an error if they are wrong, as far as
this is known without a computation, and adds what it has found in tables and folders to
the arguments.
"""
