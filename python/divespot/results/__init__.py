"""Results as users want them: tables, outlines, reports, pictures, history, comparisons."""
