;;; The original's skills.clp, but for the agent's id: its skill-call drops it.
;;; The original lies in a folder called clips; this one does not.

(batch* (path-resolve "../clips/skills.clp"))
(undeffunction skill-call)
(load* (path-resolve "skill-call.clp"))
