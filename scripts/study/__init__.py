"""The study of traction control: what is run, what is demanded, and the page that says how it ended."""
