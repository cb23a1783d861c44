"""Which constants of the core and of the package no test notices: `make mutants`."""
