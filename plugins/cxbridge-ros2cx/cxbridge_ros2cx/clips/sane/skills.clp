;;; Replaces skills.clp of ros2-clips-executive (2021), whose skill-call omits the agent's id. This file loads
;;; that skills.clp first, by the path "../clips/skills.clp": that file is in a folder clips, this file in sane.

(batch* (path-resolve "../clips/skills.clp"))
(undeffunction skill-call)
(load* (path-resolve "skill-call.clp"))
