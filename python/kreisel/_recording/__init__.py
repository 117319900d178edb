"""What came out: the core is called, a path is made of what it gave, and a failure is put into
words."""
