"""stub"""
from __future__ import annotations
import numpy as np
from typing import Any
from .._core import Tops
from .scene import Scene

class Ensemble:
    def __init__(self, scenes: Any) -> None:
        a = np.empty(np.shape(np.empty(len(scenes))) , dtype=object)
        if isinstance(scenes, np.ndarray): a = scenes
        else:
            for i, s in enumerate(scenes): a[i] = s
        self.scenes = a
        self.shape = a.shape
        self._build()
    def _build(self):
        rows = np.array([np.frombuffer(s._block) for s in self.scenes.ravel()]).reshape(*self.shape, 24)
        cols = []
        i = 0
        for w in [1, 3, 3, 4, 1, 1, 1, 4, 3, 3]:
            cols.append(np.ascontiguousarray(rows[..., i] if w == 1 else rows[..., i:i+w])); i += w
        self._tops = Tops(self.shape, cols)
        self.axes = ("top",) if len(self.shape)==1 else tuple(f"dim_{k}" for k in range(len(self.shape)))
        self.coords = {}
    def __getstate__(self): return {"scenes": self.scenes, "shape": self.shape}
    def __setstate__(self, s): self.__dict__.update(s); self._build()
    size = property(lambda s: s.scenes.size)
    ndim = property(lambda s: s.scenes.ndim)
    def __len__(self): return len(self.scenes)
    def _member(self, index): return self.scenes[index]
    def ravel(self): return self.reshape(-1)
    def reshape(self, *s): return Ensemble(self.scenes.reshape(*s))
    def __getitem__(self, key):
        x = self.scenes[key]
        return Ensemble(x) if isinstance(x, np.ndarray) else x
