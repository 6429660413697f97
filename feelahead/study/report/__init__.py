"""What a study found: planned contrasts, the page that shows them, and how many participants it takes.

Lazy imports: statsmodels, pandas, pyarrow and matplotlib come with the extra `study`.
"""
