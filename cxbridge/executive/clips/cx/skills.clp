;;; Opens the interface of the default skiller (BATCH|skills.clp); skills-calls.clp continues
;;; this file. CLIPS executes a file several times slower than it loads a file, so this file
;;; has only the commands.

(blackboard-open-reading "SkillerInterface" "Skiller")
(assert (ff-feature-loaded skills))
