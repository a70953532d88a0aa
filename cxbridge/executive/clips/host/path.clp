;;; The search path for CLIPS files, and loading along it.
;;;
;;; The values are in defglobals that are built again at each change, so that (reset)
;;; keeps them.

(defglobal
  ?*FILE-SEARCH-PATH* = (create$)    ; folders, each ends with "/"
  ?*FF-PATH-SUBST-WHAT* = (create$)  ; placeholders such as @BASEDIR@ ...
  ?*FF-PATH-SUBST-BY* = (create$))   ; ... and their replacements

(deftemplate path-info "The outcome of a request to load a file, also of a request that failed."
  (slot file (type STRING))        ; as requested
  (slot path (type STRING))        ; the path of the file; "" if the file was not found
  (slot loaded (type SYMBOL)
    (allowed-values TRUE FALSE) (default FALSE))
  (slot error-msg (type STRING)))  ; "" if the file was found, even if it did not load

(deffunction path-set-global (?name ?values)
  "Set a defglobal of this file to a value that (reset) keeps."
  (build (str-cat "(defglobal ?*" ?name "* = (create$ " (implode$ ?values) "))")))

(deffunction path-reset ()
  "Remove all folders and substitutions."
  (progn$ (?name (create$ FILE-SEARCH-PATH FF-PATH-SUBST-WHAT FF-PATH-SUBST-BY))
    (path-set-global ?name (create$))))

(deffunction path-subst (?path)
  "The path after all substitutions, in their order. Each replaces the first occurrence of its
   placeholder."
  (loop-for-count (?i (length$ ?*FF-PATH-SUBST-WHAT*))
    (bind ?path (str-replace ?path (nth$ ?i ?*FF-PATH-SUBST-WHAT*) (nth$ ?i ?*FF-PATH-SUBST-BY*))))
  ?path)

(deffunction path-get ()
  "The folders, in the order of the search."
  ?*FILE-SEARCH-PATH*)

(deffunction path-add-subst (?what ?by)
  "Replace ?what by ?by in paths that are added later."
  (path-set-global FF-PATH-SUBST-WHAT (create$ ?*FF-PATH-SUBST-WHAT* ?what))
  (path-set-global FF-PATH-SUBST-BY (create$ ?*FF-PATH-SUBST-BY* ?by)))

(deffunction path-add ($?folders)
  "Add folders to the end of the search path. Each folder ends with a slash."
  (bind ?search-path ?*FILE-SEARCH-PATH*)
  (progn$ (?folder ?folders)
    (bind ?search-path (create$ ?search-path (path-subst ?folder))))
  (path-set-global FILE-SEARCH-PATH ?search-path))

(deffunction path-resolve (?file)
  "The first <folder><file> that is a readable file, or FALSE."
  (progn$ (?folder ?*FILE-SEARCH-PATH*)
    (bind ?candidate (str-cat ?folder ?file))
    (printout debug "Trying CLIPS file " ?candidate " (looking for " ?file ")" crlf)
    (if (cx-is-file ?candidate) then
      (printout debug "Found CLIPS file " ?file " at " ?candidate crlf)
      (return ?candidate)))
  FALSE)

(deffunction path-string ()
  "The folders, separated by colons."
  (bind ?joined "")
  (progn$ (?folder ?*FILE-SEARCH-PATH*)
    (bind ?joined (str-cat ?joined (if (> ?folder-index 1) then ":" else "") ?folder)))
  ?joined)

(deffunction path-apply (?loader ?verb ?file)
  "Find the file, call the loader (load, load*, batch or batch*) with it, and assert a
   path-info fact. Returns the value of the loader; FALSE if the file is missing."
  (bind ?path (path-resolve ?file))
  (if ?path then
    (bind ?loaded (funcall ?loader ?path))
    (assert (path-info (file ?file) (path ?path) (loaded ?loaded)))
    (return ?loaded))
  (bind ?problem (str-cat "Cannot " ?verb " file " ?file " (file not found in " (path-string) ")"))
  (printout error ?problem crlf)
  (cx-not-found ?file)  ; reports a mistake in the file of the active rule
  (assert (path-info (file ?file) (error-msg ?problem)))
  FALSE)

(deffunction path-load (?file)
  (path-apply load "load" ?file))

(deffunction path-load* (?file)
  (path-apply load* "load" ?file))

(deffunction path-batch (?file)
  "CLIPS executes the file later, when it reads its next command."
  (path-apply batch "batch load" ?file))

(deffunction path-batch* (?file)
  (path-apply batch* "batch load" ?file))
