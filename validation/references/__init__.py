"""Problems, their equations, and solutions that are trusted more than what is under test."""
