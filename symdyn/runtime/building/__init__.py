"""From generated text to loaded code: compilers, the cache, libraries."""
