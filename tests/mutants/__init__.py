"""Small changes of the code, of which the tests have to notice one after another."""
